"""Which poses are likely? particle_filter.py calls: motion -> registration -> proposal -> weights -> resampling -> pose."""
