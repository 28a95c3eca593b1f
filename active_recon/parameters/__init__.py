"""The nodes' parameters, declared as data for nodes, bags, commands and tables."""
