"""A demonstration of the loop on one machine: four nodes, an observer, a bag, a picture."""
