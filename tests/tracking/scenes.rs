//! Scenes of persons that walk through a picture, made from a seed: the truth and a detector's output, as CSV of the MOT
//! Challenge.

/// A scene and its detector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) seed: u64,
    pub(crate) persons: u32,
    pub(crate) frames: u32,
    /// Probability that the detector misses a visible person.
    pub(crate) missed: f64,
    /// Mean number of false detections in a frame.
    pub(crate) false_detections: f64,
    /// Standard deviation of a box's position, in pixels. That of its sides is half of it.
    pub(crate) noise_pixels: f64,
    /// A person is not detected if a nearer one covers more than this share of their box.
    pub(crate) max_covered: f64,
    /// Frames in which no person is in the picture, in the middle of the scene.
    pub(crate) empty_frames: u32,
}

/// The files of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Files {
    pub(crate) truth: String,
    pub(crate) detections: String,
}

/// Persons that cross, without an error of the detector.
pub(crate) const PERFECT: Scene = Scene {
    name: "perfect",
    seed: 1,
    persons: 4,
    frames: 60,
    missed: 0.0,
    false_detections: 0.0,
    noise_pixels: 0.0,
    max_covered: 1.0,
    empty_frames: 0,
};

/// Scenes with crossings, occlusions, false and missed detections, and camera noise.
pub(crate) const SCENES: [Scene; 6] = [
    PERFECT,
    Scene { name: "noise", seed: 2, noise_pixels: 3.0, ..PERFECT },
    Scene { name: "occlusion", seed: 3, persons: 6, noise_pixels: 1.0, max_covered: 0.4, ..PERFECT },
    Scene { name: "misses", seed: 4, missed: 0.15, noise_pixels: 1.0, ..PERFECT },
    Scene { name: "false detections", seed: 5, false_detections: 1.0, noise_pixels: 1.0, ..PERFECT },
    Scene {
        name: "crowd",
        seed: 6,
        persons: 12,
        frames: 100,
        missed: 0.1,
        false_detections: 0.5,
        noise_pixels: 2.0,
        max_covered: 0.5,
        empty_frames: 8,
    },
];

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 480.0;

/// A deterministic pseudo-random sequence.
struct Random(u64);

/// A person that walks along a row of the picture at a constant speed.
struct Person {
    left: f64,
    speed: f64,
    bottom: f64,
    width: f64,
    height: f64,
}

/// A box in pixels: left, top, width, height.
type Pixels = [f64; 4];

impl Random {
    /// From 0 to below 1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = u32::try_from(self.0 >> 33).expect("31 bits");
        f64::from(word) / f64::from(1_u32 << 31)
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.share()
    }

    /// Nearly a normal distribution of standard deviation 1. The sum needs no function that differs between machines.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

impl Person {
    fn new(random: &mut Random, number: u32) -> Self {
        let height = random.between(130.0, 200.0);
        // Every other one walks to the left.
        let way = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        Self {
            left: random.between(0.0, WIDTH),
            speed: way * random.between(1.5, 5.0),
            bottom: random.between(height, HEIGHT),
            width: height * 0.4,
            height,
        }
    }

    /// The box in a frame.
    fn place(&self, frame: u32) -> Pixels {
        [self.left + self.speed * f64::from(frame), self.bottom - self.height, self.width, self.height]
    }
}

/// Whether a box is inside the picture at least by half.
fn is_in_picture([left, _, width, _]: Pixels) -> bool {
    (0.0..WIDTH).contains(&(left + width / 2.0))
}

/// The share of a box that another one covers.
fn covered([left, top, width, height]: Pixels, other: Pixels) -> f64 {
    let horizontal = (left + width).min(other[0] + other[2]) - left.max(other[0]);
    let vertical = (top + height).min(other[1] + other[3]) - top.max(other[1]);
    horizontal.max(0.0) * vertical.max(0.0) / (width * height)
}

impl Scene {
    /// The truth and the detections. The same scene gives the same files.
    pub(crate) fn files(&self) -> Files {
        let mut random = Random(self.seed);
        for _ in 0..8 {
            random.share();
        }
        let persons: Vec<Person> = (0..self.persons).map(|number| Person::new(&mut random, number)).collect();
        let middle = self.frames / 2;
        let mut files = Files::default();
        for frame in 1..=self.frames {
            let is_empty = (middle..middle + self.empty_frames).contains(&frame);
            let shown = (1..).zip(&persons).map(|(id, person)| (id, person.place(frame)));
            let shown: Vec<(u32, Pixels)> =
                shown.filter(|(_, place)| !is_empty && is_in_picture(*place)).collect();
            for (id, [left, top, width, height]) in &shown {
                files.truth += &format!("{frame},{id},{left},{top},{width},{height},1,-1,-1,-1\n");
            }
            // A person whose feet are lower in the picture is nearer.
            let bottom = |place: Pixels| place[1] + place[3];
            for (_, place) in &shown {
                let nearer = shown.iter().filter(|(_, other)| bottom(*other) > bottom(*place));
                let is_hidden =
                    nearer.map(|(_, other)| covered(*place, *other)).any(|share| share > self.max_covered);
                let is_missed = random.share() < self.missed;
                let noise = [1.0, 1.0, 0.5, 0.5].map(|part| part * self.noise_pixels * random.normal());
                let [left, top, width, height] = [0, 1, 2, 3].map(|index: usize| place[index] + noise[index]);
                let score = random.between(0.7, 1.0);
                if !is_hidden && !is_missed {
                    files.detections +=
                        &format!("{frame},-1,{left},{top},{width},{height},{score},-1,-1,-1\n");
                }
            }
            let mut expected = self.false_detections;
            while expected > 0.0 {
                let (height, score) = (random.between(100.0, 220.0), random.between(0.6, 0.9));
                let (left, top) = (random.between(0.0, WIDTH), random.between(0.0, HEIGHT - height));
                if random.share() < expected {
                    let width = height * 0.4;
                    files.detections +=
                        &format!("{frame},-1,{left},{top},{width},{height},{score},-1,-1,-1\n");
                }
                expected -= 1.0;
            }
        }
        files
    }
}
