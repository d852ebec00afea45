"""The vehicle: its dynamics (4.4), the movement automaton of def. 12, prediction and buffers."""
