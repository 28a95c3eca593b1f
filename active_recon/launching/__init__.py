"""The nodes as processes: started, watched and stopped together."""
