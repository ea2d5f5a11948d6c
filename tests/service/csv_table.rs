//! A reader of CSV responses.

pub struct Csv {
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Csv {
    pub fn read(text: &str) -> Csv {
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader.has_headers(false).from_reader(text.as_bytes());
        let mut lines = reader.deserialize().map(|line| line.expect("a line"));
        let head = lines.next().expect("a header");
        let rows = lines.collect();
        Csv { head, rows }
    }

    fn place(&self, name: &str) -> usize {
        let place = self.head.iter().position(|column| column == name);
        place.unwrap_or_else(|| panic!("no {name} in {:?}", self.head))
    }

    pub fn column(&self, name: &str) -> Vec<&str> {
        let place = self.place(name);
        self.rows.iter().map(|row| row[place].as_str()).collect()
    }

    pub fn text(&self, row: usize, name: &str) -> &str {
        &self.rows[row][self.place(name)]
    }

    pub fn number(&self, row: usize, name: &str) -> Option<f64> {
        self.text(row, name).parse().ok()
    }
}
