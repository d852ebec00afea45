"""A guardian of anyone's commands: wishes pass while a way out is behind them."""
