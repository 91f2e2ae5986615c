"""What a fingertip is, in numbers: layers, phalanx, ridges, fingerprint, receptors, and the presets that ship."""
