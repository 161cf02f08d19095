//! Motor process: 65 joints on several servo buses.
