"""What `scripts/demo` and `wakeup.launch` run and print.

wired_robot.py connects simulation, driver, search and localization in one process, as the nodes are by their topics.
"""
