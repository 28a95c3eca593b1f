"""Nodes as processes: started, monitored and stopped together."""
