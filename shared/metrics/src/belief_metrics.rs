//! Metrics of sources, perspectives and tasks.

use message::Loss;
use quantity::number::float;

use crate::page::{Kind, MetricsText};
use crate::readings::Readings;

pub(crate) fn write(readings: &Readings, page: &mut MetricsText) {
    sources(readings, page);
    perspectives(readings, page);
    tasks(readings, page);
}

fn sources(readings: &Readings, page: &mut MetricsText) {
    page.family(
        "leo_source_silent",
        Kind::Gauge,
        None,
        "1 while the source should send frames and sends none.",
    );
    for source in &readings.sources {
        page.gauge(&[("source", source.name.as_str())], f64::from(u8::from(source.silent != 0)));
    }
    page.family("leo_source_frames", Kind::Counter, None, "Frames read from the source.");
    for source in &readings.sources {
        page.count(&[("source", source.name.as_str())], source.frames);
    }
    page.family("leo_source_observations", Kind::Counter, None, "Observations that became percepts.");
    for source in &readings.sources {
        page.count(&[("source", source.name.as_str())], source.observations);
    }
    page.family(
        "leo_source_losses",
        Kind::Counter,
        None,
        "Frames or observations lost or refused, by the reason.",
    );
    for source in &readings.sources {
        for loss in Loss::ALL {
            page.count(&[("source", source.name.as_str()), ("reason", loss.name())], source.lost(*loss));
        }
    }
}

fn perspectives(readings: &Readings, page: &mut MetricsText) {
    let paths: Vec<String> = readings
        .perspectives
        .iter()
        .map(|perspective| format!("{:?}", perspective.path.agents().unwrap_or_default()))
        .collect();
    let each = || paths.iter().map(String::as_str).zip(&readings.perspectives);
    page.family("leo_perspective_steps", Kind::Counter, None, "Steps of the perspective's belief system.");
    for (path, perspective) in each() {
        page.count(&[("perspective", path)], perspective.steps);
    }
    page.family(
        "leo_perspective_beliefs",
        Kind::Counter,
        None,
        "Sum of the numbers of beliefs after each step: divide by the steps.",
    );
    for (path, perspective) in each() {
        page.count(&[("perspective", path)], perspective.beliefs);
    }
    page.family(
        "leo_perspective_over_capacity",
        Kind::Counter,
        None,
        "Observations, beliefs and occluders beyond the perspective's capacity.",
    );
    for (path, perspective) in each() {
        page.count(&[("perspective", path)], perspective.left_out);
    }
    page.family(
        "leo_perspective_refused",
        Kind::Counter,
        None,
        "Observations and evaluations that the perspective refused as invalid.",
    );
    for (path, perspective) in each() {
        page.count(&[("perspective", path)], perspective.refused);
    }
}

fn tasks(readings: &Readings, page: &mut MetricsText) {
    page.family("leo_store_bytes", Kind::Gauge, Some("bytes"), "Size of the file of the learned tasks.");
    if let Some(bytes) = readings.store_bytes {
        page.gauge(&[], float(bytes));
    }
    page.family("leo_task_examples", Kind::Gauge, None, "Examples seen of the task.");
    for task in &readings.tasks {
        page.gauge(&[("task", &task.name)], float(task.examples));
    }
    page.family(
        "leo_task_hypotheses",
        Kind::Gauge,
        None,
        "Hypotheses published for the task after its last demonstration.",
    );
    for task in &readings.tasks {
        for (perspective, count) in &task.hypotheses {
            page.gauge(&[("task", &task.name), ("perspective", perspective)], float(*count));
        }
    }
}
