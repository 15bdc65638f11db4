"""All trials by name."""

from benchmarks.trade import impacts, rotating, sliding, standing, truths
from benchmarks.trade.trial import Trial

TRIALS: dict[str, Trial] = {
    trial.name: trial
    for trial in (
        *sliding.TRIALS,
        *impacts.TRIALS,
        *rotating.TRIALS,
        *standing.TRIALS,
        *truths.TRIALS,
    )
}
