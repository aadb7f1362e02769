"""MOTION -> PROPOSAL -> WEIGHTS -> RESAMPLING -> POSE: the Monte Carlo filter."""
