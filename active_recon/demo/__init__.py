"""The loop on one machine, for people to watch: four nodes, an observer, a bag, a picture."""
