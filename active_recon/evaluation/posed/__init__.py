"""Comparison of networks on posed views: datasets, robustness tests and photographs."""
