//! From text to a typed value: document, schema, serde.

use serde::de::DeserializeOwned;

use super::{
    checker::Checker,
    document::Document,
    errors::{FormError, FormErrors, FormProblem},
    path::Path,
    schema::Schema,
    walk::{Hints, complete},
};

/// Reads a text strictly by its schema. `label` names the file in messages, and each override is `dotted.key=value`.
///
/// The checker contains the mistakes found so far and collects those of the caller's own checks. Wrong values are replaced by
/// placeholders, about which the checker reports nothing more.
///
/// # Errors
/// All mistakes, if they leave no value: a required key that has no placeholder, since its type takes only some strings.
pub fn decode<T: DeserializeOwned>(
    label: &str,
    text: &str,
    overrides: &[String],
    schema: &Schema,
    hints: &dyn Hints,
) -> Result<(T, Checker), FormErrors> {
    let (document, syntax) = Document::read(label, text, overrides);
    Checker::new(document, syntax).decode(schema, hints)
}

/// Reads a text that is part of the program, such as standard defaults.
///
/// The text is read as a table first, as in [`decode`], so that a type is compiled for one reader only.
///
/// # Panics
/// When the text does not fit the type: a bug of the program, which a test finds.
pub fn decode_own<T: DeserializeOwned>(text: &str) -> T {
    let table: toml::Table = text.parse().expect("TOML");
    T::deserialize(table).expect("the text has the keys of the type")
}

impl Checker {
    /// Decodes a document that was already read; see [`decode`].
    ///
    /// # Errors
    /// See [`decode`].
    pub fn decode<T: DeserializeOwned>(mut self, schema: &Schema, hints: &dyn Hints) -> Result<(T, Self), FormErrors> {
        self.check_schema(schema, hints);
        // The placeholders are only for the value: the document stays as written.
        let mut root = self.document.root.clone();
        complete(&mut root, schema.value());
        match T::deserialize(root.to_table()) {
            Ok(spec) => Ok((spec, self)),
            Err(_) if self.count() > 0 => Err(self.into_errors()),
            Err(error) => Err(self.into_mismatch(&error)),
        }
    }

    /// Decodes keys that passed the schema, with defaults filled in.
    ///
    /// # Errors
    /// When the type refuses keys that its schema accepts: a bug of the program, reported with the mistakes of the file.
    pub fn value_of<T: DeserializeOwned>(self, keys: &toml::Table) -> Result<(T, Self), FormErrors> {
        match T::deserialize(keys.clone()) {
            Ok(value) => Ok((value, self)),
            Err(error) => Err(self.into_mismatch(&error)),
        }
    }

    /// The mistakes, and a bug of the program: its types refuse keys that its schema accepts.
    fn into_mismatch(mut self, error: &toml::de::Error) -> FormErrors {
        let root = Path::default();
        let problem = FormProblem::Syntax { message: error.message().to_owned() };
        let help = Some("this is a mistake in the program's own schema".to_owned());
        self.report(FormError { location: self.document.location_of(&root), key: String::new(), problem, help }, root);
        self.into_errors()
    }
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, time::Instant};

    use schemars::JsonSchema;
    use serde::Deserialize;

    use super::*;
    use crate::{Mistakes, Requirement, schema_of};

    /// A workshop.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Workshop {
        /// Name.
        name: String,
        /// Tools.
        tools: Vec<Tool>,
        /// When it is open.
        hours: Hours,
        /// Paint by colour.
        #[serde(default)]
        paint: BTreeMap<String, f64>,
    }

    /// A tool.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Tool {
        /// Kind.
        kind: Kind,
        /// Weight.
        #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "kg"))]
        weight: f64,
    }

    #[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        /// For nails.
        Hammer,
        /// For wood.
        Saw,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(untagged)]
    enum Hours {
        /// Always, or never.
        Whole(bool),
        /// From one hour to another.
        Part(Part),
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Part {
        /// First hour.
        #[schemars(range(max = 23))]
        from: u32,
        /// Last hour.
        #[schemars(range(max = 24))]
        to: u32,
    }

    struct Advice;

    impl Hints for Advice {
        fn unknown_key(&self, _: &Path, key: &str) -> Option<String> {
            (key == "colour").then(|| "give `paint`".to_owned())
        }

        fn missing(&self, path: &Path) -> Option<(Requirement, String)> {
            (*path == Path::from("name")).then(|| ("a name on the door".into(), "any will do".to_owned()))
        }
    }

    fn read(text: &str) -> Result<(Workshop, Checker), FormErrors> {
        decode("shop.toml", text, &[], &schema_of::<Workshop>("a workshop"), &Advice)
    }

    fn mistakes(text: &str) -> Vec<String> {
        let errors = read(text).and_then(|(_, checker)| checker.finish()).expect_err("mistakes");
        errors.to_string().lines().map(str::to_owned).collect()
    }

    const GOOD: &str = "name = \"shed\"\nhours = { from = 8, to = 17 }\npaint = { red = 1.5 }\n\
                        [[tools]]\nkind = \"saw\"\nweight = 1\n";

    #[test]
    fn a_file_without_mistakes_is_its_value() {
        let (shop, checker) = read(GOOD).expect("no mistakes");
        assert_eq!(shop.tools, [Tool { kind: Kind::Saw, weight: 1.0 }]);
        assert_eq!(shop.hours, Hours::Part(Part { from: 8, to: 17 }));
        assert_eq!(shop.paint["red"], 1.5);
        assert!(checker.finish().is_ok());
    }

    #[test]
    fn every_kind_of_mistake_has_its_place_and_words() {
        for (from, to, expected) in [
            ("name = \"shed\"\n", "", "shop.toml:1:1: name: missing: expected a name on the door; any will do"),
            ("\"shed\"", "3", "shop.toml:1:8: name: expected a string, found 3"),
            (
                "\"saw\"",
                "\"sew\"",
                "shop.toml:5:8: tools[0].kind: `sew` is not one of hammer, saw; did you mean `saw`?",
            ),
            ("\"saw\"", "1", "shop.toml:5:8: tools[0].kind: expected one of \"hammer\", \"saw\", found 1"),
            ("= 1\n", "= 0\n", "shop.toml:6:10: tools[0].weight: expected a number above 0 [kg], found 0"),
            ("weight", "wieght", "shop.toml:6:1: tools[0].wieght: unknown key `wieght`; did you mean `weight`?"),
            ("to = 17", "to = 25", "shop.toml:2:26: hours.to: expected a whole number from 0 to 24, found 25"),
            ("from = 8, to = 17", "form = 8", "shop.toml:2:11: hours.form: unknown key `form`; did you mean `from`?"),
            (
                "{ from = 8, to = 17 }",
                "\"late\"",
                "shop.toml:2:9: hours: expected true or false, or a table with from, to, found the string \"late\"",
            ),
            ("1.5", "nan", "shop.toml:3:17: paint.red: expected a number, found NaN"),
            ("paint =", "colour =", "shop.toml:3:1: colour: unknown key `colour`; give `paint`"),
        ] {
            let text = GOOD.replace(from, to);
            assert_ne!(text, GOOD);
            assert!(mistakes(&text).contains(&expected.to_owned()), "{:#?}", mistakes(&text));
        }
    }

    #[test]
    fn what_is_wrong_hides_nothing_else() {
        let text = "hours = { from = 8 }\n[[tools]]\nweight = -1\n[[tools]]\nkind = \"saw\"\nweight = 2\n";
        let (shop, mut checker) = read(text).expect("placeholders stand in");
        assert_eq!((shop.name.as_str(), &shop.hours), ("", &Hours::Whole(false)));
        assert_eq!(shop.tools[0], Tool { kind: Kind::Hammer, weight: 1.0 });
        // Placeholders are not reported; other values are.
        checker.invalid("name", "a name that rhymes", "\"\"");
        checker.invalid("hours", "a shop that opens", "false");
        checker.invalid(Path::from("tools").index(1).key("weight"), "a light saw", "2 kg");
        let errors = checker.finish().expect_err("mistakes");
        let keys: Vec<&str> = errors.list().iter().map(|error| error.key.as_str()).collect();
        assert_eq!(keys, ["hours.to", "name", "tools[0].kind", "tools[0].weight", "tools[1].weight"]);
        assert!(errors.render().ends_with("5 errors in shop.toml\n"));
    }

    #[test]
    fn a_broken_line_hides_nothing_else() {
        let text = GOOD.replace("\"shed\"", "").replace("= 1\n", "= 0\n");
        let found = mistakes(&text);
        assert!(found[0].starts_with("shop.toml:1:8: not TOML: "), "{found:#?}");
        assert!(found.iter().any(|line| line.contains("tools[0].weight: expected")), "{found:#?}");
    }

    /// Half a megabyte of unknown keys, one per line and all on one line: time and text grow with their count alone.
    #[test]
    fn many_mistakes_take_linear_time() {
        const COUNT: usize = 50_000;
        let keys = |separator: &str| (0..COUNT).map(|key| format!("k{key:06}=1{separator}")).collect::<String>();
        let line = keys(",");
        for text in [keys("\n"), format!("hours = {{{}}}\n", line.trim_end_matches(','))] {
            let began = Instant::now();
            let errors = read(&text).and_then(|(_, checker)| checker.finish()).expect_err("mistakes");
            assert!(errors.count() >= COUNT && errors.list().len() == Mistakes::MOST);
            assert!(errors.render().contains(" more\n"), "how many are not shown is said");
            let (bytes, seconds) = (errors.render().len(), began.elapsed().as_secs_f64());
            assert!(seconds < 10.0 && bytes < 600 * COUNT, "{seconds} s, {bytes} bytes");
        }
    }
}
