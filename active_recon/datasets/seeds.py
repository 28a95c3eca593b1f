"""The seeds of parametric shapes: no object is in two splits."""

SEEDS = 1_000_000
"""How many seeds each split has of a category."""
FIRST_SEEDS = {'train': 0, 'val': SEEDS, 'test': 2 * SEEDS, 'unseen': 3 * SEEDS}
"""The first of each split's; `unseen` has the held-out categories alone."""
