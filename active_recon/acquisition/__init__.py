"""Which images of a camera become views, and what is wrong with its stream."""
