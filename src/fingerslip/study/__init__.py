"""Studies: from a YAML file over its runs to a folder of results.

Reading a study (:mod:`~fingerslip.study.definition`) must not load what computes it
(:mod:`~fingerslip.study.running`), so this package names nothing itself.
"""
