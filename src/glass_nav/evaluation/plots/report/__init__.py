"""The pictures of a report, a file per picture; report_pictures.py has their order."""
