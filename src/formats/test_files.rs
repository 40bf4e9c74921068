//! Small files made by hand, for tests.

/// Writes RGL tensor files field by field, right or wrong.
#[derive(Clone, Default)]
pub(crate) struct RglFile {
    /// Name, element type, shape, data.
    pub fields: Vec<(String, u8, Vec<u64>, Vec<u8>)>,
}

impl RglFile {
    /// An isotropic RGB file whose tables are constants but for `vndf` and `rgb`, which are functions of (theta index, row,
    /// column) and (theta index, channel, row, column); both have `size` x `size` nodes, and there are `theta` elevations.
    pub fn isotropic(
        theta: &[f32],
        size: usize,
        vndf: impl Fn(usize, usize, usize) -> f32,
        rgb: impl Fn(usize, usize, usize, usize) -> f32,
    ) -> Self {
        let (t, n) = (theta.len(), size as u64);
        let mut file = Self::default();
        file.bytes("description", b"made by hand");
        file.floats("phi_i", &[1], &[0.0]);
        file.floats("theta_i", &[t as u64], theta);
        // ndf = 4, sigma = 1: the factor ndf / (4 sigma) is 1.
        file.floats("ndf", &[2, 2], &[4.0; 4]);
        file.floats("sigma", &[2, 2], &[1.0; 4]);
        let grid = |c: usize| (0..t).flat_map(move |k| (0..c).flat_map(move |c| (0..size * size).map(move |i| (k, c, i / size, i % size))));
        let values: Vec<f32> = grid(1).map(|(k, _, y, x)| vndf(k, y, x)).collect();
        file.floats("vndf", &[1, t as u64, n, n], &values);
        file.floats("luminance", &[1, t as u64, n, n], &vec![1.0; t * size * size]);
        let values: Vec<f32> = grid(3).map(|(k, c, y, x)| rgb(k, c, y, x)).collect();
        file.floats("rgb", &[1, t as u64, 3, n, n], &values);
        file.bytes("jacobian", &[1]);
        file
    }

    pub fn floats(&mut self, name: &str, shape: &[u64], values: &[f32]) {
        self.put(name, 10, shape, values.iter().flat_map(|v| v.to_le_bytes()).collect());
    }

    pub fn bytes(&mut self, name: &str, values: &[u8]) {
        self.put(name, 1, &[values.len() as u64], values.to_vec());
    }

    /// Adds a field, or replaces the one of that name.
    pub fn put(&mut self, name: &str, dtype: u8, shape: &[u64], data: Vec<u8>) {
        let field = (name.to_owned(), dtype, shape.to_vec(), data);
        match self.fields.iter_mut().find(|f| f.0 == name) {
            Some(old) => *old = field,
            None => self.fields.push(field),
        }
    }

    pub fn drop(&mut self, name: &str) {
        self.fields.retain(|f| f.0 != name);
    }

    /// The file, its data in the order of the fields.
    pub fn finish(&self) -> Vec<u8> {
        let directory: usize = self.fields.iter().map(|f| 2 + f.0.len() + 2 + 1 + 8 + 8 * f.2.len()).sum();
        let mut out = b"tensor_file\0\x01\0".to_vec();
        out.extend(u32::try_from(self.fields.len()).unwrap().to_le_bytes());
        let mut offset = (out.len() + directory) as u64;
        for (name, dtype, shape, data) in &self.fields {
            out.extend(u16::try_from(name.len()).unwrap().to_le_bytes());
            out.extend(name.as_bytes());
            out.extend(u16::try_from(shape.len()).unwrap().to_le_bytes());
            out.push(*dtype);
            out.extend(offset.to_le_bytes());
            out.extend(shape.iter().flat_map(|s| s.to_le_bytes()));
            offset += data.len() as u64;
        }
        out.extend(self.fields.iter().flat_map(|f| &f.3));
        out
    }
}
