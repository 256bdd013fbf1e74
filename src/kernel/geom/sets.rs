//! Disjoint sets of numbers.

/// Disjoint sets, each named by its lowest member.
pub struct Sets(Vec<u32>);

impl Sets {
    /// Makes `members` sets of one number each.
    pub fn new(members: usize) -> Self {
        Self((0..members as u32).collect())
    }

    /// The lowest member of the set that holds `member`.
    pub fn root(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let up = self.0[member as usize];
            self.0[member as usize] = self.0[up as usize];
            member = up;
        }
        member
    }

    /// Joins the sets of `a` and `b`.
    pub fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
