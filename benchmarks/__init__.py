"""Speed and accuracy compared with other programs (`make bench`); populations of recordings."""
