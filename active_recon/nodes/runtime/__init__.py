"""What every node needs: life cycle, clock, QoS, parameters, diagnostics."""
