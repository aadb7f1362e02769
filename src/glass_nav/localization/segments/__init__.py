"""Corrects a rough pose by one scan and the wall segments of a map: `glass_nav locate` and the service ~locate."""
