"""What the choice of the next view is worth on a frozen network: ceilings, baselines, policies."""
