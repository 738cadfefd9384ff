//! Malicious messages of viewers: each is rejected with a message, and the scene file is unchanged.

use serde_json::{Value, json};
use wgray_dev::{Command, Set};

use super::running::{Files, SCENE, serve};
use super::viewer::Viewer;

fn set(path: &str, value: &Value) -> String {
    json!({ "set": { "path": path, "value": value } }).to_string()
}

#[test]
fn invalid_messages_are_rejected_and_the_file_is_unchanged() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let (session, address) = serve(running);
    let mut viewer = Viewer::new(address);

    let radius = |value: &str| format!("{{\"set\":{{\"path\":\"shapes[0].radius\",\"value\":{value}}}}}");
    let nested = |count: usize| radius(&format!("{}1{}", "[".repeat(count), "]".repeat(count)));
    let number = "must be a number";
    let nothing = "cannot be changed";
    let path = "must be a path, such as shapes[2].radius";
    let unknown = "not understood: ";
    let mut messages = vec![
        // values of other types, and values that are not numbers
        (radius("{}"), number),
        (radius("{\"a\":1}"), number),
        (radius("[0.5]"), number),
        (radius("true"), number),
        (radius("\"0.5\""), number),
        (radius("\"NaN\""), number),
        (radius("\"0.5\\n[render]\\nseed = 7\""), number),
        (radius("NaN"), unknown),
        (radius("Infinity"), unknown),
        (radius("1e999"), unknown),
        (radius("-1e999"), unknown),
        (radius(&"9".repeat(400)), unknown),
        (radius("1e308"), "1e308 must be"),
        (radius("18446744073709551615"), "1.8446744073709552e19 must be"),
        (radius("-0.0"), "must be"),
        (radius("5e-324"), "5e-324 must be"),
        (nested(100), number),
        (nested(1500), unknown),
        (set("image.width", &json!(1e300)), "must be a whole number"),
        (set("image.width", &json!(-1)), "-1 must be"),
        (set("image.width", &json!(u64::MAX)), "must be a whole number"),
        (
            set("shapes[0].center", &json!([0, 0, null])),
            "must be a list of 3 numbers",
        ),
        (
            set("shapes[0].center", &json!([0, 0, 0, 0])),
            "must be a list of 3 numbers",
        ),
        (
            set("shapes[0].center", &json!(vec![0; 1500])),
            "must be a list of 3 numbers",
        ),
        (
            set("shapes[0].center", &json!([0, [0], 0])),
            "must be a list of 3 numbers",
        ),
        (set("shapes[0].center", &json!([0, 0, 1e300])), "shapes[0].center: "),
        (
            set("shapes[0].material", &json!("red\"\nradius = 7 #")),
            "must be one of the allowed names",
        ),
        (set("materials.red.type", &json!("glass")), nothing),
        // paths outside of the scene, or to no value
        (set("shapes[0].radius.x", &json!(1)), nothing),
        (set("shapes[18446744073709551616].radius", &json!(1)), "must"),
        (set("shapes[-1].radius", &json!(1)), "must"),
        (set("shapes[4294967296].radius", &json!(1)), nothing),
        (set("render.seed = 7\n[camera]\nfov", &json!(1)), path),
        (set("render.seed # ", &json!(1)), path),
        (set("render.\"seed = 7\\n\"", &json!(1)), nothing),
        (set("\"render]\\nseed = 7\\n[x\".seed", &json!(1)), nothing),
        (set("materials.\"red]\\n[camera\".shininess", &json!(1)), nothing),
        (set("materials.'\"'.shininess", &json!(1)), nothing),
        (set("__proto__.seed", &json!(1)), nothing),
        (set("render.\u{1b}[2Jseed", &json!(1)), "must"),
        (set(&"a.".repeat(1500), &json!(1)), "must"),
        (
            set(&vec!["render"; 500].join("."), &json!(1)),
            "must have at most 80 steps",
        ),
        (set(&"[0]".repeat(1000), &json!(1)), "must"),
        (set(&"a".repeat(3900), &json!(1)), nothing),
        (set("", &json!(1)), "must be"),
        ("{\"set\":{\"path\":\"render.seed\"}}".to_owned(), unknown),
        ("{\"set\":{\"path\":5,\"value\":1}}".to_owned(), unknown),
        ("{\"set\":{\"path\":[\"render\"],\"value\":1}}".to_owned(), unknown),
        (
            "{\"set\":{\"path\":\"render.seed\",\"value\":1,\"file\":\"/etc/passwd\"}}".to_owned(),
            unknown,
        ),
        (
            "{\"set\":{\"path\":\"render.seed\",\"value\":1,\"gesture\":-1}}".to_owned(),
            unknown,
        ),
        (
            "{\"set\":{\"path\":\"render.seed\",\"path\":\"render.seed\",\"value\":1}}".to_owned(),
            unknown,
        ),
        ("{\"set\":null}".to_owned(), unknown),
        ("{\"set\":".to_owned(), unknown),
        ("\u{0}".to_owned(), unknown),
        ("[".repeat(4000), unknown),
    ];
    // The same for an absent key.
    messages.push((set("render.shadow_epsilon", &json!("0.01")), number));
    let mut wrong = Vec::new();
    for (message, expected) in messages {
        let reason = viewer.refused(&message);
        let is_plain = reason.chars().count() < 400 && !reason.chars().any(char::is_control);
        if !reason.contains(expected) || !is_plain || files.read("scene.toml") != SCENE {
            wrong.push((message.chars().take(100).collect::<String>(), reason));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(session.state().undo, None);
    // Control: a valid message takes effect; none above did.
    let mut other = Viewer::new(address);
    other.say(set("shapes[0].radius", &json!(0.25)).as_bytes()).unwrap();
    session.wait("the value that is right", |_| {
        (files.read("scene.toml") == SCENE.replace("radius = 0.5", "radius = 0.25")).then_some(())
    });
    session.wait_rendered(&files);

    // Not text, or too long: only its own connection closes.
    for message in [&b"\xff\xfe{"[..], set(&"a".repeat(1 << 20), &json!(1)).as_bytes()] {
        let mut other = Viewer::new(address);
        let _ = other.say(message); // the server may close the connection during the message
        while other.hear().is_some() {}
    }
    let reason = viewer.refused(&set("shapes[0].radius", &json!([])));
    assert!(reason.contains(number), "{reason}");
}

#[test]
fn a_path_of_a_megabyte_is_rejected_with_a_short_message() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    for path in [
        "a".repeat(1 << 20),
        "a.".repeat(1 << 19) + "b",
        "\"\\u001b\".".repeat(1 << 17) + "b",
        "\u{1b}".repeat(1 << 20),
        format!("materials.\"{}\".shininess", "é".repeat(1 << 19)),
    ] {
        let executed = running.state().executed;
        running.session.send(Command::Set(Set {
            path,
            value: json!("x".repeat(1 << 20)),
            gesture: None,
        }));
        running.wait("the command to be followed", |running| {
            (running.state().executed > executed).then_some(())
        });
        let notice = running.state().notice.clone().unwrap();
        assert!(notice.bad && notice.command == running.state().executed);
        assert!(
            notice.text.chars().count() < 1000 && !notice.text.contains('\u{1b}'),
            "{}",
            notice.text
        );
        assert_eq!(files.read("scene.toml"), SCENE);
    }
}
