//! MCAP: ROS 2 messages, JSON and Protobuf become columns; what is cut off or damaged is one error.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use prost_reflect::prost::Message as _;
use prost_reflect::prost_types::field_descriptor_proto::{Label, Type};
use prost_reflect::prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::{joint, says};
use trueup_signals::{Case, Finding, FindingKind, Loaded, Recording, Severity, SignalsError};

const JOINT_STATE: &str = "std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
    ================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const ARRAY: &str = "MultiArrayLayout layout\nfloat64[] data # numbers\n================\nMSG: std_msgs/MultiArrayLayout\nMultiArrayDimension[] dim\nuint32 data_offset\n\
    ================\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n";

/// Plain CDR, the lowest byte first.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }
    fn raw(mut self, bytes: &[u8]) -> Self {
        while (self.0.len() - 4) % bytes.len() != 0 {
            self.0.push(0);
        }
        self.0.extend(bytes);
        self
    }
    fn whole(self, x: u32) -> Self {
        self.raw(&x.to_le_bytes())
    }
    fn text(self, text: &str) -> Self {
        let mut own = self.whole(text.len() as u32 + 1);
        own.0.extend(text.as_bytes());
        own.0.push(0);
        own
    }
    fn numbers(self, x: &[f64]) -> Self {
        x.iter().fold(self.whole(x.len() as u32), |own, x| own.raw(&x.to_le_bytes()))
    }
}

fn joint_state(t: u64, names: &[&str], position: &[f64], effort: &[f64]) -> Vec<u8> {
    let head = Cdr::new().whole((t / 1_000_000_000) as u32).whole((t % 1_000_000_000) as u32).text("base");
    let named = names.iter().fold(head.whole(names.len() as u32), |own, n| own.text(n));
    named.numbers(position).numbers(&[]).numbers(effort).0
}

/// A file with messages: topic, time at which it was logged in ns, bytes.
struct File<'a>(Writer<Cursor<Vec<u8>>>, BTreeMap<&'a str, u16>);

impl<'a> File<'a> {
    fn new(compression: Option<Compression>) -> Self {
        let options = WriteOptions::new().compression(compression);
        Self(options.create(Cursor::new(Vec::new())).unwrap(), BTreeMap::new())
    }
    fn topic(&mut self, topic: &'a str, [messages, name, defined]: [&str; 3], schema: &[u8]) {
        let schema = if defined.is_empty() { 0 } else { self.0.add_schema(name, defined, schema).unwrap() };
        let channel = self.0.add_channel(schema, topic, messages, &BTreeMap::new()).unwrap();
        self.1.insert(topic, channel);
    }
    fn ros(&mut self, topic: &'a str, name: &str, definition: &str) {
        self.topic(topic, ["cdr", name, "ros2msg"], definition.as_bytes());
    }
    fn write(&mut self, topic: &str, t: u64, bytes: &[u8]) {
        let header = MessageHeader { channel_id: self.1[topic], sequence: 0, log_time: t, publish_time: t };
        self.0.write_to_known_channel(&header, bytes).unwrap();
    }
    fn bytes(mut self) -> Vec<u8> {
        self.0.finish().unwrap();
        self.0.into_inner().into_inner()
    }
}

fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    fs::write(&file, bytes).unwrap();
    (folder, file)
}

fn read(name: &str, bytes: &[u8]) -> (Recording, Vec<Finding>) {
    let (_folder, file) = written(name, bytes);
    Recording::read(&file, &[], &Default::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn wrong(name: &str, bytes: &[u8]) -> Vec<Finding> {
    let (_folder, file) = written(name, bytes);
    match Recording::read(&file, &[], &Default::default()).unwrap_err() {
        SignalsError::Wrong(findings) => findings,
        other => panic!("{other}"),
    }
}

fn values<'a>(run: &'a Recording, name: &str) -> &'a [f64] {
    let names: Vec<_> = run.channels.iter().map(|c| &c.name).collect();
    &run.channel(name).unwrap_or_else(|| panic!("{name} in {names:?}")).values
}

/// 2026-01-01 in ns.
const BEGIN: u64 = 1_767_225_600_000_000_000;

/// Messages are stamped; they are logged later, and not evenly.
fn states(compression: Option<Compression>) -> Vec<u8> {
    let mut file = File::new(compression);
    file.ros("/joint_states", "sensor_msgs/msg/JointState", JOINT_STATE);
    for k in 0..50_u64 {
        let (t, x) = (BEGIN + k * 10_000_000, k as f64);
        let logged = t + 3_000_000 + (k * 7919) % 2_000_000;
        // The order of the joints is the publisher's affair.
        let bytes = match k % 2 {
            0 => joint_state(t, &["motor", "load"], &[x, 0.1 * x], &[2.0 * x, 0.0]),
            _ => joint_state(t, &["load", "motor"], &[0.1 * x, x], &[0.0, 2.0 * x]),
        };
        file.write("/joint_states", logged, &bytes);
    }
    file.bytes()
}

#[test]
fn joint_states_are_columns_by_joint_at_the_times_of_their_stamps() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let (run, findings) = read("run.mcap", &states(compression));
        let at = |scale: f64| (0..50).map(|k| scale * f64::from(k)).collect::<Vec<_>>();
        assert_eq!(values(&run, "/joint_states.position[1]"), at(1.0));
        assert_eq!(values(&run, "/joint_states.position[2]"), at(0.1));
        assert_eq!(values(&run, "/joint_states.effort[1]"), at(2.0));
        let time = &run.channel("/joint_states.position[1]").unwrap().time;
        assert!(time.iter().enumerate().all(|(k, t)| (t - 0.01 * k as f64).abs() < 1e-9), "{time:?}");
        says("clock", &findings, Severity::Note, FindingKind::TimeUnit, &["the stamps of the messages"]);
        assert!(run.channels.iter().all(|c| !c.name.contains("stamp")), "a stamp is the time, no signal");
    }
}

#[test]
fn topics_of_their_own_rates_have_samples_of_their_own() {
    let mut file = File::new(Some(Compression::Zstd));
    file.ros("/command", "std_msgs/msg/Float64MultiArray", ARRAY);
    file.topic("/encoder", ["json", "", ""], b"");
    for k in 0..20_u64 {
        if k % 2 == 0 {
            let bytes =
                Cdr::new().whole(1).text("axis").whole(2).whole(2).whole(0).numbers(&[k as f64, -1.0]).0;
            file.write("/command", k * 5_000_000, &bytes);
        }
        let text = format!("{{\"axis\": {{\"angle\": [{k}, 0.5], \"ok\": true}}, \"mode\": \"run\"}}");
        file.write("/encoder", k * 5_000_000, text.as_bytes());
    }
    let (run, findings) = read("run.mcap", &file.bytes());
    let command = run.channel("/command.data[1]").unwrap();
    assert_eq!((command.len(), command.values[3], command.time[3]), (10, 6.0, 0.03));
    assert_eq!(values(&run, "/encoder.axis.angle[1]").len(), 20);
    assert_eq!(values(&run, "/encoder.axis.ok")[0], 1.0);
    says("clock", &findings, Severity::Note, FindingKind::TimeUnit, &["logged"]);
}

#[test]
fn protobuf_is_read_by_its_descriptor() {
    let field = |name: &str, number: i32, kind: Type, label: Label| FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        r#type: Some(kind.into()),
        label: Some(label.into()),
        ..Default::default()
    };
    let message = DescriptorProto {
        name: Some("Drive".into()),
        field: vec![
            field("current", 1, Type::Double, Label::Optional),
            field("angle", 2, Type::Float, Label::Repeated),
        ],
        ..Default::default()
    };
    let file = FileDescriptorProto {
        name: Some("drive.proto".into()),
        package: Some("rig".into()),
        syntax: Some("proto3".into()),
        message_type: vec![message],
        ..Default::default()
    };
    let schema = FileDescriptorSet { file: vec![file] }.encode_to_vec();
    let mut out = File::new(None);
    out.topic("/drive", ["protobuf", "rig.Drive", "protobuf"], &schema);
    for k in 0..5_u8 {
        // current = k (left out where it is 0), angle = [k, 1]
        let mut bytes = Vec::new();
        if k > 0 {
            bytes.push(0x09);
            bytes.extend(f64::from(k).to_le_bytes());
        }
        bytes.extend([0x12, 8]);
        bytes.extend(f32::from(k).to_le_bytes());
        bytes.extend(1.0_f32.to_le_bytes());
        out.write("/drive", u64::from(k) * 1_000_000, &bytes);
    }
    let (run, _) = read("run.mcap", &out.bytes());
    assert_eq!(values(&run, "/drive.current"), [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(values(&run, "/drive.angle[1]"), [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(values(&run, "/drive.angle[2]"), [1.0; 5]);
}

fn case(columns: &str) -> Result<(Loaded, Vec<Finding>), SignalsError> {
    let (folder, _) = written("run.mcap", &states(None));
    let text = format!("model = \"TwoMassJoint\"\ntrain = [\"run.mcap\"]\n[columns]\n{columns}");
    fs::write(folder.path().join("case.toml"), text).unwrap();
    Case::load(folder.path(), |_| Ok(joint()))
}

#[test]
fn fields_are_mapped_by_their_path_counted_from_1_or_from_0() {
    let last = |loaded: &Loaded, name: &str| *values(&loaded.recordings["run.mcap"], name).last().unwrap();
    let (one, _) = case(
        "\"/joint_states.position[1]\" = \"motorAngle\"\n\"/joint_states.position[2]\" = \"loadAngle\"\n",
    )
    .unwrap();
    assert_eq!([last(&one, "motorAngle"), last(&one, "loadAngle")], [49.0, 0.1 * 49.0]);
    let (zero, findings) = case(
        "\"/joint_states.position[0]\" = \"motorAngle\"\n\"/joint_states.position[1]\" = \"loadAngle\"\n",
    )
    .unwrap();
    assert_eq!([last(&zero, "motorAngle"), last(&zero, "loadAngle")], [49.0, 0.1 * 49.0]);
    says("from 0", &findings, Severity::Note, FindingKind::UnknownColumn, &["counted from 0", "[columns]"]);
    let Err(SignalsError::Wrong(findings)) = case("\"/joint_state.position[1]\" = \"motorAngle\"\n") else {
        panic!()
    };
    says("typo", &findings, Severity::Error, FindingKind::UnknownColumn, &["case.toml:4:", "did you mean"]);
}

#[test]
fn what_is_cut_off_anywhere_is_one_error_that_says_so() {
    for compression in [None, Some(Compression::Zstd)] {
        let whole = states(compression);
        for share in [3, 20, 50, 90, 99] {
            let found = wrong("run.mcap", &whole[..whole.len() * share / 100]);
            assert_eq!(found.len(), 1, "{share} %: {found:?}");
            let what = if share == 3 && whole.len() * 3 / 100 < 8 { "MCAP" } else { "truncated" };
            says(
                "cut",
                &found,
                Severity::Error,
                FindingKind::Unreadable,
                &["run.mcap: ", what, "mcap recover"],
            );
        }
    }
    says("empty", &wrong("run.mcap", &[]), Severity::Error, FindingKind::EmptyFile, &["empty"]);
}

/// Damage is an error or other values, but never a panic; an error names the file.
#[test]
fn damaged_files_get_an_answer() {
    let seed = rand::rng().random::<u64>();
    println!("seed {seed}");
    let mut draw = StdRng::seed_from_u64(seed);
    let whole = states(None);
    for _ in 0..200 {
        let mut bytes = whole.clone();
        for _ in 0..draw.random_range(1..6) {
            let at = draw.random_range(0..bytes.len());
            bytes[at] = draw.random();
        }
        let (_folder, file) = written("run.mcap", &bytes);
        if let Err(e) = Recording::read(&file, &[], &Default::default()) {
            assert!(e.to_string().contains("run.mcap"), "seed {seed}: {e}");
        }
    }
}

#[test]
fn what_is_not_read_is_named() {
    let mut file = File::new(None);
    file.topic("/old", ["ros1", "x/Y", "ros1msg"], b"float64 x\n");
    file.write("/old", 0, &[0; 8]);
    let found = wrong("run.mcap", &file.bytes());
    says(
        "ros1",
        &found,
        Severity::Error,
        FindingKind::EmptyFile,
        &["`/old` is left out", "ros1msg", "JSON or Protobuf"],
    );
    let found = wrong("run.db3", b"SQLite format 3");
    says("db3", &found, Severity::Error, FindingKind::Unreadable, &["ros2 bag convert"]);
}

#[test]
fn zstd_is_unpacked_by_the_name_of_the_file() {
    let text = "time,x\n0,1\n1,2\n2,5\n";
    let (run, _) = read("run.csv.zst", &zstd::encode_all(text.as_bytes(), 3).unwrap());
    assert_eq!(values(&run, "x"), [1.0, 2.0, 5.0]);
    let (run, _) = read("run.mcap.zst", &zstd::encode_all(&states(None)[..], 3).unwrap());
    assert_eq!(values(&run, "/joint_states.position[1]").len(), 50);
    let cut = zstd::encode_all(text.as_bytes(), 3).unwrap();
    let found = wrong("run.csv.zst", &cut[..cut.len() - 4]);
    says("cut", &found, Severity::Error, FindingKind::Unreadable, &["run.csv.zst", "zstd"]);
}
