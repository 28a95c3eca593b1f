"""The parameters of each node, as data that nodes, bags, commands and tables read."""
