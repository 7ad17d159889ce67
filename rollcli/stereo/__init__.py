"""A stereo pair becomes a disparity map: views levelled, range found, matched, refined."""
