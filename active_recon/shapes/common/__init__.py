"""What the generators of several categories share."""
