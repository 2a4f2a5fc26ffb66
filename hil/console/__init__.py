"""The rig in a browser: runs, records, set-up and campaigns on one page."""
