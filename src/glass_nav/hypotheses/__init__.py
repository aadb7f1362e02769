"""Many poses at once, each followed and scored: where may the scans have been taken?"""
