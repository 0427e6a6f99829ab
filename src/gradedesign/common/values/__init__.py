"""Values and tables of a case file: units, quantities, formulas, suggestions, the line of a key.

Door: `Where`, `Table`, `Quantity`, `Refused`, `locating`, `shown`, `instead`, `supplied_by`.
"""
