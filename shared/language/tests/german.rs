//! The second language, as a proof that a language is data.

use language::{ActKind, BuiltIn, Context, Reading};

#[test]
fn german_sentences_are_understood() {
    let grammar = BuiltIn::German.grammar();
    let strings = |words: &str| words.split(',').map(str::to_owned).collect();
    let idle = Context {
        tasks: strings("aufgabe 1,füllen"),
        current: Some("füllen".to_owned()),
        features: strings("red,blue,square,peg"),
        ..Context::default()
    };
    let showing = Context { showing: Some("stapeln".to_owned()), ..idle.clone() };
    let moving = Context { is_moving: true, ..idle.clone() };
    for (context, text, kind) in [
        (&idle, "Hallo Leo", ActKind::Greet),
        (&idle, "Hilfe!", ActKind::Help),
        (&idle, "Was kann ich sagen?", ActKind::Help),
        (&idle, "Ich zeige dir Stapeln", ActKind::Teach),
        (&idle, "Ich möchte dir etwas beibringen", ActKind::Teach),
        (&idle, "Schau mir zu", ActKind::Teach),
        (&showing, "Das heißt Türme bauen", ActKind::Name),
        (&showing, "Ich bin fertig", ActKind::End),
        (&showing, "Stapeln ist fertig", ActKind::End),
        (&showing, "Abbrechen", ActKind::Cancel),
        (&idle, "Mach Füllen", ActKind::Do),
        (&idle, "Könntest du bitte füllen machen?", ActKind::Do),
        (&idle, "mach aufgabe eins", ActKind::Do),
        (&idle, "Mach fülen", ActKind::Do),
        (&idle, "Du bist dran", ActKind::Do),
        (&idle, "Nochmal bitte", ActKind::Again),
        (&idle, "Vergiss Füllen", ActKind::Forget),
        (&idle, "Welche Aufgaben kennst du?", ActKind::ListTasks),
        (&idle, "Was hast du gelernt?", ActKind::Learned),
        (&idle, "Was siehst du?", ActKind::SeeLeo),
        (&idle, "Wo ist das blaue Quadrat?", ActKind::KnowLeo),
        (&idle, "Sehe ich das blaue Quadrat?", ActKind::SeeMe),
        (&idle, "Warum?", ActKind::Why),
        (&idle, "Bist du sicher?", ActKind::HowSure),
        (&idle, "Und jetzt?", ActKind::WhatNext),
        (&idle, "Nur die roten", ActKind::TellOnly),
        (&idle, "Danke schön", ActKind::Thank),
        (&idle, "Gut gemacht", ActKind::Praise),
        (&idle, "Ja, genau", ActKind::Confirm),
        (&idle, "Das war falsch", ActKind::Deny),
        (&idle, "Nein, so", ActKind::LikeThis),
        (&moving, "Stopp!", ActKind::Stop),
        (&moving, "Sotpp", ActKind::Stop),
        (&moving, "Leo, halt bitte an", ActKind::Stop),
        (&moving, "Warte", ActKind::Stop),
        (&moving, "nein", ActKind::Stop),
        (&moving, "Hör auf damit", ActKind::Stop),
        (&moving, "nicht aufhören", ActKind::KeepOn),
        (&moving, "mach weiter", ActKind::GoOn),
    ] {
        match grammar.understand(text, context) {
            Reading::Understood(act) => assert_eq!(act.kind, kind, "{text}"),
            Reading::Guessed { sentence, .. } => panic!("{text} is not understood; nearest: {sentence}"),
        }
    }
    let object = grammar.understand("Wo ist das blaue Quadrat?", &idle);
    let Reading::Understood(act) = object else { panic!("{object:?}") };
    assert_eq!(act.objects, [["blue", "square"]]);
}
