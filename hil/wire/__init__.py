"""The wire to the board: dialect, framing, link, handshake."""
