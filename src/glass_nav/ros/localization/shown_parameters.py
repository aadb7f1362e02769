"""The parameters in effect on the parameter server while the node runs: `rosparam get /amcl/tf_broadcast`, as with AMCL.

Parameters that were not set are removed at the end; otherwise the next start would take them as set.
"""

from __future__ import annotations

from typing import Any, Dict, Mapping

import rospy

NOT_SHOWN = ("initial_pose_", "initial_cov_")  # the node keeps its pose there itself, as AMCL does


class ShownParameters:
    """Written when made."""

    def __init__(self, values: Mapping[str, Any], given: Mapping[str, Any]) -> None:
        """
        Args:
            values: all in effect, by name.
            given: those that are on the server already.
        """
        self._shown: Dict[str, Any] = {
            name: value for name, value in values.items() if name not in given and not name.startswith(NOT_SHOWN)
        }
        try:
            for name, value in self._shown.items():
                rospy.set_param(f"~{name}", value)
        except OSError as err:
            rospy.logwarn(f"the parameters in effect are not shown: no parameter server ({err})")

    def hide(self) -> None:
        """Take away those that still have the value that was shown: others were set while the node ran."""
        try:
            now = rospy.get_param("~", {})
            for name, value in self._shown.items():
                if name in now and now[name] == value:
                    rospy.delete_param(f"~{name}")
        except (OSError, KeyError):  # the master is gone, and the parameters with it
            return
