"""The particle filter: motion -> proposal -> weights -> resampling -> pose."""
