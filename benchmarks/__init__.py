"""Speed and accuracy of the periodic response, against other ways to compute it: `make bench`."""
