"""The nodes: the only package that imports rospy, tf2 and messages. Nothing is decided here.

There is a package for each node. What they share is here: conversions of messages (conversions.py), the passing of
messages from callbacks to the run loop (mailbox.py), and how a node starts and ends (shutdown.py).
"""

import threading

if not hasattr(threading.Thread, "isAlive"):
    # rospy 1.15.9, which Debian 11 has, calls it when a node ends, and the node would end with a traceback: Python 3.9
    # knows only the other name.
    threading.Thread.isAlive = threading.Thread.is_alive  # type: ignore[attr-defined]
