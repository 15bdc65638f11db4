"""Speed and accuracy, measured together with peers. No other package imports this one."""
