"""Studies: from a YAML file over its runs to a folder of results.

``definition`` reads the file, ``running`` computes its runs, ``storage`` writes and reads their results,
``convergence`` repeats them with finer settings, and ``inspection`` shows presets, studies and results. Reading a
study must not load what computes it, so this package imports none of them.
"""
