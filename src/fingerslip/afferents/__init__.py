"""From the tissue at a receptor to the spikes of its afferent: stimuli, their spectra, and models of afferents.

A model takes arrays and gives spike times (:class:`~fingerslip.afferents.model.AfferentModel`), so models of others fit
in without more. The project's own is :class:`~fingerslip.afferents.model.IntegrateAndFire`.
"""
