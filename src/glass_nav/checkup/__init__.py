"""What is wrong with a robot, its bag or its map? The findings of `glass_nav doctor`, each with its remedy.

doctor.py runs the checks; there is a file for each kind of them.
"""
