//! Scans a simulated bus: `cargo run -p leo-servo --example scan`.
//!
//! A broadcast ping finds every servo. Each one replies with its ID, its model number and its firmware version.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;

use clock::Instant;
use servo::mock::{Line, Servo};
use servo::{Address, Id, Instruction, Model, Parser, Status};

fn main() -> Result<(), Box<dyn Error>> {
    let now = Instant::EPOCH;
    let servos = [(1, Model::Xm430W350), (2, Model::Xm430W350), (7, Model::Xl330M288)];
    let servos = servos.into_iter().filter_map(|(id, model)| Some(Servo::new(model, Id::new(id)?, 0.0, now)));
    let mut bus = Line::new(servos.collect());

    let mut request = [0; 16];
    let length = Instruction::Ping.encode(Address::All, &mut request)?;
    let mut replies = Vec::new();
    bus.hear(now, request.get(..length).unwrap_or_default(), &mut replies);

    let mut parser = Parser::new();
    parser.push(&replies);
    let mut found = 0;
    while let Some(frame) = parser.next_frame() {
        let Some(Status { id, fault: None, params: &[low, high, firmware], .. }) = Status::parse(&frame)
        else {
            continue;
        };
        let model = Model::from_number(u16::from_le_bytes([low, high])).map_or("unknown model", Model::name);
        println!("id {}: {model}, firmware {firmware}", id.get());
        found += 1;
    }
    assert_eq!(found, bus.servos.len(), "every servo replies");
    Ok(())
}
