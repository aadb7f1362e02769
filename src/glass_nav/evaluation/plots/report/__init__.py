"""The pictures of a report, a file for each; report_pictures.py has their order."""
