"""The LOOK binary of xlook, the data program of the Penn State rock mechanics laboratory."""
