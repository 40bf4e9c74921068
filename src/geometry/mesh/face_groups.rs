//! Which faces of a mesh hang together, and how each is turned against the others.

/// Groups of faces that hang together by edges of exactly two faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaceGroups {
    /// Triangles of each group, the first one first.
    pub groups: Vec<Vec<usize>>,
    /// For each triangle whether it is turned against the first one of its group.
    pub against: Vec<bool>,
    /// Edges (two vertices) of three faces and more: nothing says which of these belong together.
    pub crowded: Vec<[u32; 2]>,
    /// Groups of one side only, such as a Möbius strip, whose faces cannot all be turned alike: the place of each, and an edge where that shows.
    pub one_sided: Vec<(usize, [u32; 2])>,
}

/// No face, or more than one, at the other side of an edge.
const NONE: u32 = u32::MAX;

impl FaceGroups {
    /// The groups of triangles whose corners are places of vertices; vertices at one place have to be one. A triangle that has a corner twice is a group of its own.
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let (neighbours, crowded) = neighbours(triangles);
        let mut found = Self { groups: Vec::new(), against: vec![false; triangles.len()], crowded, one_sided: Vec::new() };
        let mut reached = vec![false; triangles.len()];
        for start in 0..triangles.len() {
            if reached[start] {
                continue;
            }
            reached[start] = true;
            let mut group = vec![start];
            let mut twisted = None;
            let mut next = 0;
            while next < group.len() {
                let t = group[next];
                next += 1;
                for (edge, &other) in edges(&triangles[t]).iter().zip(&neighbours[t]).filter(|(_, other)| **other != NONE) {
                    let (other, [a, b]) = (other as usize, *edge);
                    let wanted = found.against[t] == edges(&triangles[other]).contains(&[b, a]);
                    if !reached[other] {
                        reached[other] = true;
                        found.against[other] = wanted;
                        group.push(other);
                    } else if found.against[other] != wanted {
                        twisted = twisted.or(Some([a, b]));
                    }
                }
            }
            found.one_sided.extend(twisted.map(|edge| (found.groups.len(), edge)));
            found.groups.push(group);
        }
        found
    }

    /// The faces that are turned against the larger part of the area of their group, where it has two sides; of equal parts the first face's is right.
    pub fn minority(&self, area: impl Fn(usize) -> f64) -> Vec<usize> {
        let mut wrong = Vec::new();
        for (k, group) in self.groups.iter().enumerate() {
            if self.one_sided.iter().any(|(one_sided, _)| *one_sided == k) {
                continue;
            }
            let sum = |against: bool| -> f64 { group.iter().filter(|&&t| self.against[t] == against).map(|&t| area(t)).sum() };
            let least = sum(true) <= sum(false);
            wrong.extend(group.iter().copied().filter(|&t| self.against[t] == least));
        }
        wrong
    }
}

/// The edges of a triangle, as it runs.
pub fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// For each edge of each triangle the one triangle at its other side, and the edges of more than two.
fn neighbours(triangles: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<[u32; 2]>) {
    // Both vertices, the lower first, and the triangle: sorted, those of an edge lie side by side.
    let mut all: Vec<[u32; 3]> = Vec::with_capacity(3 * triangles.len());
    for (t, corners) in (0..).zip(triangles) {
        let edges = edges(corners);
        if edges.iter().all(|[a, b]| a != b) {
            all.extend(edges.map(|[a, b]| [a.min(b), a.max(b), t]));
        }
    }
    all.sort_unstable();
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    let mut crowded = Vec::new();
    for faces in all.chunk_by(|a, b| a[..2] == b[..2]) {
        let [low, high, _] = faces[0];
        match faces {
            [[.., first], [.., second]] if first != second => {
                for (t, other) in [(*first, *second), (*second, *first)] {
                    let corners = edges(&triangles[t as usize]);
                    let place = corners.iter().position(|&[a, b]| [a.min(b), a.max(b)] == [low, high]).expect("the edge came from it");
                    neighbours[t as usize][place] = other;
                }
            }
            [_, _, _, ..] => crowded.push([low, high]),
            _ => {}
        }
    }
    (neighbours, crowded)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles 0 1 2, 2 1 3, 2 3 4 and so on, all turned alike.
    fn strip(count: u32) -> Vec<[u32; 3]> {
        (0..count).map(|k| if k % 2 == 0 { [k, k + 1, k + 2] } else { [k + 1, k, k + 2] }).collect()
    }

    #[test]
    fn faces_turned_against_most_of_their_neighbours_are_found() {
        let mut triangles = strip(6);
        let all_alike = FaceGroups::new(&triangles);
        assert_eq!((all_alike.groups.len(), all_alike.minority(|_| 1.0)), (1, vec![]));
        triangles[0].swap(1, 2);
        triangles[3].swap(1, 2);
        let mut wrong = FaceGroups::new(&triangles).minority(|_| 1.0);
        wrong.sort_unstable();
        assert_eq!(wrong, [0, 3]);
        // By area, not by number.
        let mut wrong = FaceGroups::new(&triangles).minority(|t| if t == 0 { 10.0 } else { 1.0 });
        wrong.sort_unstable();
        assert_eq!(wrong, [1, 2, 4, 5]);
    }

    #[test]
    fn an_edge_of_three_faces_joins_none_of_them() {
        let found = FaceGroups::new(&[[0, 1, 2], [1, 0, 3], [1, 0, 4], [2, 1, 5]]);
        assert_eq!(found.crowded, [[0, 1]]);
        assert_eq!(found.groups, [vec![0, 3], vec![1], vec![2]]);
    }

    #[test]
    fn a_strip_with_one_side_is_found_and_left_as_it_is() {
        let mut triangles = strip(8);
        // Its ends joined with a twist.
        triangles.extend([[8, 1, 9], [9, 1, 0]]);
        let found = FaceGroups::new(&triangles);
        assert_eq!(found.one_sided.len(), 1);
        assert!(found.minority(|_| 1.0).is_empty());
    }

    #[test]
    fn what_has_a_corner_twice_belongs_to_nothing() {
        let found = FaceGroups::new(&[[0, 1, 2], [0, 0, 1], [1, 0, 3]]);
        assert_eq!(found.groups, [vec![0, 2], vec![1]]);
    }
}
