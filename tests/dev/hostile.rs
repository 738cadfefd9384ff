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
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (session, address) = serve(session);
    let mut viewer = Viewer::new(address);

    let radius_message = |value: &str| format!("{{\"set\":{{\"path\":\"shapes[0].radius\",\"value\":{value}}}}}");
    let nested = |count: usize| radius_message(&format!("{}1{}", "[".repeat(count), "]".repeat(count)));
    let number_rule = "must be a number";
    let not_editable = "cannot be changed";
    let path_rule = "must be a path, such as shapes[2].radius";
    let not_understood = "not understood: ";
    let mut messages = vec![
        // Values of other types, values out of range, and text that is not JSON.
        (radius_message("{}"), number_rule),
        (radius_message("{\"a\":1}"), number_rule),
        (radius_message("[0.5]"), number_rule),
        (radius_message("true"), number_rule),
        (radius_message("\"0.5\""), number_rule),
        (radius_message("\"NaN\""), number_rule),
        (radius_message("\"0.5\\n[render]\\nseed = 7\""), number_rule),
        (radius_message("NaN"), not_understood),
        (radius_message("Infinity"), not_understood),
        (radius_message("1e999"), not_understood),
        (radius_message("-1e999"), not_understood),
        (radius_message(&"9".repeat(400)), not_understood),
        (radius_message("1e308"), "1e308 must be"),
        (radius_message("18446744073709551615"), "1.8446744073709552e19 must be"),
        (radius_message("-0.0"), "must be"),
        (radius_message("5e-324"), "5e-324 must be"),
        (nested(100), number_rule),
        (nested(1500), not_understood),
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
        (set("materials.red.type", &json!("glass")), not_editable),
        // Paths to keys that do not exist, invalid paths, and messages of the wrong structure.
        (set("shapes[0].radius.x", &json!(1)), not_editable),
        (set("shapes[18446744073709551616].radius", &json!(1)), "must"),
        (set("shapes[-1].radius", &json!(1)), "must"),
        (set("shapes[4294967296].radius", &json!(1)), not_editable),
        (set("render.seed = 7\n[camera]\nfov", &json!(1)), path_rule),
        (set("render.seed # ", &json!(1)), path_rule),
        (set("render.\"seed = 7\\n\"", &json!(1)), not_editable),
        (set("\"render]\\nseed = 7\\n[x\".seed", &json!(1)), not_editable),
        (set("materials.\"red]\\n[camera\".shininess", &json!(1)), not_editable),
        (set("materials.'\"'.shininess", &json!(1)), not_editable),
        (set("__proto__.seed", &json!(1)), not_editable),
        (set("render.\u{1b}[2Jseed", &json!(1)), "must"),
        (set(&"a.".repeat(1500), &json!(1)), "must"),
        (
            set(&vec!["render"; 500].join("."), &json!(1)),
            "must have at most 80 segments",
        ),
        (set(&"[0]".repeat(1000), &json!(1)), "must"),
        (set(&"a".repeat(3900), &json!(1)), not_editable),
        (set("", &json!(1)), "must be"),
        ("{\"set\":{\"path\":\"render.seed\"}}".to_owned(), not_understood),
        ("{\"set\":{\"path\":5,\"value\":1}}".to_owned(), not_understood),
        (
            "{\"set\":{\"path\":[\"render\"],\"value\":1}}".to_owned(),
            not_understood,
        ),
        (
            "{\"set\":{\"path\":\"render.seed\",\"value\":1,\"file\":\"/etc/passwd\"}}".to_owned(),
            not_understood,
        ),
        (
            "{\"set\":{\"path\":\"render.seed\",\"value\":1,\"gesture\":-1}}".to_owned(),
            not_understood,
        ),
        (
            "{\"set\":{\"path\":\"render.seed\",\"path\":\"render.seed\",\"value\":1}}".to_owned(),
            not_understood,
        ),
        ("{\"set\":null}".to_owned(), not_understood),
        ("{\"set\":".to_owned(), not_understood),
        ("\u{0}".to_owned(), not_understood),
        ("[".repeat(4000), not_understood),
    ];
    // Values of keys that the scene file does not contain are checked, too.
    messages.push((set("render.shadow_epsilon", &json!("0.01")), number_rule));
    let mut failures = Vec::new();
    for (message, expected) in messages {
        let reason = viewer.send_rejected(&message);
        let is_short_and_printable = reason.chars().count() < 400 && !reason.chars().any(char::is_control);
        if !reason.contains(expected) || !is_short_and_printable || files.read("scene.toml") != SCENE {
            failures.push((message.chars().take(100).collect::<String>(), reason));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert_eq!(session.state().undo, None);
    // Positive control: a valid message takes effect; none of the messages above did.
    let mut second_viewer = Viewer::new(address);
    second_viewer
        .send_text(set("shapes[0].radius", &json!(0.25)).as_bytes())
        .unwrap();
    session.wait("the valid value", |_| {
        (files.read("scene.toml") == SCENE.replace("radius = 0.5", "radius = 0.25")).then_some(())
    });
    session.wait_for_rendered_image(&files);

    // A message that is not text or is too long only closes its own connection.
    for message in [&b"\xff\xfe{"[..], set(&"a".repeat(1 << 20), &json!(1)).as_bytes()] {
        let mut second_viewer = Viewer::new(address);
        let _ = second_viewer.send_text(message); // the server may close the connection during the message
        while second_viewer.receive_text().is_some() {}
    }
    let reason = viewer.send_rejected(&set("shapes[0].radius", &json!([])));
    assert!(reason.contains(number_rule), "{reason}");
}

#[test]
fn a_path_of_a_megabyte_is_rejected_with_a_short_message() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    for path in [
        "a".repeat(1 << 20),
        "a.".repeat(1 << 19) + "b",
        "\"\\u001b\".".repeat(1 << 17) + "b",
        "\u{1b}".repeat(1 << 20),
        format!("materials.\"{}\".shininess", "é".repeat(1 << 19)),
    ] {
        let executed = session.state().executed;
        session.inner.send(Command::Set(Set {
            path,
            value: json!("x".repeat(1 << 20)),
            gesture: None,
        }));
        session.wait("the end of the command", |session| {
            (session.state().executed > executed).then_some(())
        });
        let notice = session.state().notice.clone().unwrap();
        assert!(notice.bad && notice.command == session.state().executed);
        assert!(
            notice.text.chars().count() < 1000 && !notice.text.contains('\u{1b}'),
            "{}",
            notice.text
        );
        assert_eq!(files.read("scene.toml"), SCENE);
    }
}
