"""The report of a recording: tables, figures, one page that opens anywhere.

``recording`` reads a bag and runs the estimators over it, ``analysis`` measures, ``tables`` and
``figures`` show, ``page`` puts it together, ``csv_files`` keeps the numbers.
"""
