"""A simulated building, robot and lidar with the physics of glass; the same seed gives the same scans.

simulation.py drives the robot and records the ground truth. The localization never imports this package, nor this
package the localization, so that no filter is tested against its own model of glass.
"""
