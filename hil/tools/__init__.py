"""Tools beside a run: bring-up, doctor, localise, twin server, bridge, benches."""
