"""Studies: from a YAML file over its runs to a folder of results.

Reading a study (:mod:`~fingerslip.study.spec`) must not load what computes it (:mod:`~fingerslip.study.runner`),
so this package names nothing itself.
"""
