"""Localization of ROS 1 robots with a 2D lidar in buildings with glass walls."""

import os as _os

# One BLAS thread, unless the user asked for more: our matrices have three rows, and OpenBLAS' other threads would spin
# for them (two thirds of a node's CPU). OpenBLAS and MKL follow this variable where their own is not set. It must be set
# before numpy is loaded, so every program imports this first.
_os.environ.setdefault("OMP_NUM_THREADS", "1")
del _os
