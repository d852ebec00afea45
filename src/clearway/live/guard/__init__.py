"""A guardian of anyone's commands: wishes pass while an escape is behind them."""
