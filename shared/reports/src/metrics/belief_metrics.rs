//! Metrics of sources, perspectives and tasks.

use message::{Loss, PerspectiveHealth, SourceHealth};
use quantity::number::float;

use super::readings::Readings;
use super::text::{Field, Kind, MetricsText, one_if};

const COUNTS: [Field<PerspectiveHealth>; 4] = [
    ("leo_perspective_steps", "Steps of the perspective's belief system.", |perspective| perspective.steps),
    (
        "leo_perspective_beliefs",
        "Sum of the numbers of beliefs after each step: divide by the steps.",
        |perspective| perspective.beliefs,
    ),
    (
        "leo_perspective_over_capacity",
        "Observations, beliefs and occluders beyond the perspective's capacity.",
        |perspective| perspective.over_capacity,
    ),
    (
        "leo_perspective_refused",
        "Observations and evaluations that the perspective refused as invalid.",
        |perspective| perspective.refused,
    ),
];

const SOURCE_COUNTS: [Field<SourceHealth>; 2] = [
    ("leo_source_frames", "Frames read from the source.", |source| source.frames),
    ("leo_source_observations", "Observations that became percepts.", |source| source.observations),
];

pub(crate) fn write(readings: &Readings, page: &mut MetricsText) {
    sources(&readings.sources, page);
    let paths = readings.perspectives.iter().map(|perspective| perspective.path.agents().unwrap_or_default());
    let paths: Vec<String> = paths.map(|path| format!("{path:?}")).collect();
    page.counters(&COUNTS, "perspective", paths.iter().zip(&readings.perspectives));
    tasks(readings, page);
}

fn sources(sources: &[SourceHealth], page: &mut MetricsText) {
    let silent = sources.iter().map(|source| (source.name.as_str(), one_if(source.silent != 0)));
    page.gauges(
        "leo_source_silent",
        "1 while the source should send frames and sends none.",
        "source",
        silent,
    );
    page.counters(&SOURCE_COUNTS, "source", sources.iter().map(|source| (source.name.as_str(), source)));
    page.family("leo_source_losses", Kind::Counter, "Frames or observations lost or refused, by the reason.");
    for source in sources {
        for loss in Loss::ALL {
            page.count(&[("source", source.name.as_str()), ("reason", loss.name())], source.lost(*loss));
        }
    }
}

fn tasks(readings: &Readings, page: &mut MetricsText) {
    page.family("leo_store_bytes", Kind::Gauge, "Size of the file of the learned tasks.");
    if let Some(bytes) = readings.store_bytes {
        page.gauge(&[], float(bytes));
    }
    let examples = readings.tasks.iter().map(|task| (&task.name, float(task.examples)));
    page.gauges("leo_task_examples", "Examples seen of the task.", "task", examples);
    page.family(
        "leo_task_hypotheses",
        Kind::Gauge,
        "Hypotheses published for the task after its last demonstration.",
    );
    for task in &readings.tasks {
        for (perspective, count) in &task.hypotheses {
            page.gauge(&[("task", &task.name), ("perspective", perspective)], float(*count));
        }
    }
}
