"""Names of the files of a run record."""

MANIFEST = "manifest.json"
RESERVE = ".reserve"  # while the record is being written
SAMPLES = "samples.parquet"
SAMPLES_JOURNAL = "samples.journal"
FRAMES = "frames.parquet"
FRAMES_JOURNAL = "frames.journal"
LINK = "link.tlog"
TAPE = "inputs.tape"
EVENTS = "events.jsonl"
CAMERA = "camera.mkv"
CAMERA_SMALL = "camera-small.avi"
RERUN = "run.rrd"
FIGURES = "metrics.json"
PICTURES = "pictures"
PLUGINS = "plugins"  # texts of laws, estimators, ... that came from files
