//! What has no light in it: linear algebra, sampling, statistics.

pub mod randomized_svd;
