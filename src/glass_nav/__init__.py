"""Where is a ROS 1 robot with a 2D lidar, in a building full of glass?"""

import os as _os

# One BLAS thread, unless the user asked for more: our matrices have three rows, and OpenBLAS' other threads would spin
# for them (two thirds of a node's CPU). It must be set before numpy is loaded, so every program imports this first.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    _os.environ.setdefault(_name, "1")
del _name, _os
