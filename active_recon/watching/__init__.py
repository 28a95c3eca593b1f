"""Photos that arrive one after the other: the shape so far, and where to stand next."""
